"""The files of a run directory."""

FILES = ("scenario.toml", "platform.toml", "log.csv", "truth.csv", "estimates.csv", "meta.json")
ADDED_FILES = ("trajectory.csv", "rig.toml", "report.html")  # of a motion file, of a rig, of hexload report
