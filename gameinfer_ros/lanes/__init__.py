"""SIMD lanes under Numba: several particles side by side in the processor's vector registers."""

from gameinfer_ros.lanes import compile_cache

compile_cache.keep_apart()  # before anything of this package is compiled
