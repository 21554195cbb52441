"""`hexload faults`: faults put into clean logs, one at a time, and what the estimators make of them.

In the order of the data flow: recording (a clean run) -> sensor_faults, timing_faults, machine_faults, load_faults (what
goes wrong, on arrays) -> kinds (the list of them) -> score (what a run's answer is worth) -> one_fault (a case) -> tally
-> fault_report. verb ties them together; machines, files and seeds are those of hexload.campaign.
"""
