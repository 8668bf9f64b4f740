"""Options of `ses deploy`: what its fleet drives, and what its logs look like."""

from datetime import datetime
from typing import Annotated, Literal

import typer

DeploymentsOption = Annotated[int, typer.Option(metavar="N", min=1, help="Drives to record.")]
DriverOption = Annotated[str, typer.Option(metavar="NAME", help="Who drives.")]
LogFormatOption = Annotated[
    Literal["mcap", "db3", "bag", "tables"], typer.Option("--format", help="Of the logs.")
]
MinDistanceOption = Annotated[
    float | None, typer.Option(metavar="D", help="Least start-goal distance [m].")
]
RobotsOption = Annotated[
    int | None, typer.Option(metavar="N", min=1, help="Robots that take turns in a world.")
]
DrivesPerLogOption = Annotated[
    int | None, typer.Option(metavar="N", min=1, help="Drives in one log; 1, in tables 50.")
]
SplitSecondsOption = Annotated[
    float | None,
    typer.Option(metavar="S", help="MCAP and db3: a new file of the log after so long."),
]
PublishMapOption = Annotated[
    bool, typer.Option("--publish-map", help="Record the world as a map, too.")
]
OdometryDriftOption = Annotated[
    float | None,
    typer.Option(
        metavar="D",
        min=0.0,
        max=0.2,
        help="Share by which ways and turns are off; 0.01 is real.",
    ),
]
DateOption = Annotated[
    datetime | None,
    typer.Option(formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="Day it drove; else today."),
]
