"""`hexload campaign`: seeded Monte Carlo runs of simulator and firmware, and what the estimators make of them.

In the order of the data flow: cases (what is drawn) -> one_case (simulate, identify, bound; with the baselines, on
leg_regression) -> store (a file per case) -> schedule (on which machines) -> progress -> statistics -> campaign_report,
with its campaign_figures. verb ties them together. Store, schedule and progress take the cases of hexload.faults too.
"""
