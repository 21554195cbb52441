"""Pages and tables: of a run, of a replay, the paper's Table 3."""
