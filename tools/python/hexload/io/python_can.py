"""python-can and cantools, without what the former imports for MF4 files: asammdf, and with it pandas, take ten times as
long as the rest. mf4_log.py reads such files by asammdf itself.
"""

import sys

_missing = "asammdf" not in sys.modules
if _missing:
    sys.modules["asammdf"] = None  # an import of it fails, which python-can is prepared for
try:
    import can
    import cantools
finally:
    if _missing:
        del sys.modules["asammdf"]

__all__ = ["can", "cantools"]
