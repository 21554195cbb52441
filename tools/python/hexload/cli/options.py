"""Options and arguments that several verbs have, each with its help."""

from pathlib import Path
from typing import Annotated, Literal

import typer

Estimator = Literal["paper", "momentum", "momentum_effects"]

BUSES = "socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT, slcan:DEVICE"

# What is printed.
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures as JSON, in SI units, instead of the summary.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress, no summary.")]
View = Annotated[bool, typer.Option("--view", help="Then play it in the browser, as hexload view does.")]

# Files.
PlatformFile = Annotated[Path, typer.Option(help="Platform file (.toml).")]
EmptyLog = Annotated[
    Path, typer.Argument(help="Leg log of the empty platform, in motion; formats as of hexload replay.")
]
Force = Annotated[bool, typer.Option("--force", help="Replace files that are already there.")]

# How a log is read.
Columns = Annotated[
    list[str] | None,
    typer.Option(
        help='Which column is which channel, its unit and sign: a file (.toml), or a line of one, as dl = "Cylinder {leg} \\[mm]". Repeatable.'
    ),
]
Resample = Annotated[
    float | None, typer.Option(help="Resample the log to regular ticks of this period, s, by linear interpolation.")
]
Unchecked = Annotated[
    bool,
    typer.Option("--unchecked", help="Go on with a log whose units, signs or order contradict each other, as it is."),
]

# Estimator and controller.
Prior = Annotated[
    Literal["safe", "printed"] | None, typer.Option(help="Start covariance, instead of the platform file's.")
]
Profile = Annotated[
    Literal["fd", "classic"] | None, typer.Option(help="Frames of the bus: CAN FD or classic CAN.", show_default="fd")
]
ListenBus = Annotated[str | None, typer.Option(help=f"Bus to listen on: {BUSES}.")]
ListenLcm = Annotated[str | None, typer.Option(help="LCM to listen on: its URL, or default.")]

# Campaigns.
SeedBase = Annotated[
    int | None,
    typer.Option(
        min=0,
        help="First seed; the cases of each class or fault count on from it.",
        show_default="the date of the clone's last commit, so that no figure is of seeds used in development",
    ),
]
Restart = Annotated[bool, typer.Option("--restart", help="Do the cases again that are done.")]
