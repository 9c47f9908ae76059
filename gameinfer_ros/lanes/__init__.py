"""SIMD lanes for Numba: several particles side by side in the processor's vector registers."""

from gameinfer_ros.lanes import compile_cache

compile_cache.keep_apart()  # must precede the first compilation
