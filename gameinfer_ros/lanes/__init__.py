"""SIMD lanes for Numba: several particles side by side in the processor's vector registers."""
