"""Formulas on arrays: the Cramer-Rao bound, motions that excite, regressions, consistency."""
