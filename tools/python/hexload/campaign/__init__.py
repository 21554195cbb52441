"""`hexload campaign`: seeded Monte Carlo runs of simulator and firmware, and what the estimators make of them.

In the order of the data flow: cases (what is drawn) -> one_case (simulate, identify, bound; with the baselines, on
leg_regression) -> schedule (on which machines) -> store (a file per case) -> statistics -> campaign_report, with its
campaign_figures. verb ties them together.
"""
