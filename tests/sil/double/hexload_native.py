"""First on the path, it makes `import hexload_native` the module of the double-precision reference firmware."""

import sys

import hexload_native_double

sys.modules[__name__] = hexload_native_double
