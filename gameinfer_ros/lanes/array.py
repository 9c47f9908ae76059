"""The annotation of arrays in kernels, and the number of lanes; they need no Numba."""

from typing import Any

#: Annotation of arrays in kernels, whose types Numba infers.
Array = Any

#: Number of lanes for several particles: that of an AVX-512 register. On processors with shorter
#: registers, the compiler uses several of them.
WIDE = 8
