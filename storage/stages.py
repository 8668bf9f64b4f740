"""Every stage's name and version, in one table.

Raise a stage's version whenever its output for the same inputs would mean something else:
its artifacts, and whatever was made from them, are then built anew.
"""

from ses_core.recipes import Stage

INGEST = Stage("ingest", 1)
EXTRACT = Stage("extract", 1)
BATCH = Stage("batch", 1)
FILTER = Stage("filter", 1)
FIT = Stage("fit", 2)
SYNTHESIZE = Stage("synthesize", 2)
SCORECARD = Stage("scorecard", 1)
DIFFICULTY = Stage("difficulty", 1)
RENDER = Stage("render", 1)
TRAIN = Stage("train", 3)
EVALUATE = Stage("evaluate", 4)
REPORT = Stage("report", 3)
PRETRAIN = Stage("pretrain", 3)
DEPLOY = Stage("deploy", 2)

STAGES = (
    INGEST,
    EXTRACT,
    BATCH,
    FILTER,
    FIT,
    SYNTHESIZE,
    SCORECARD,
    DIFFICULTY,
    RENDER,
    TRAIN,
    EVALUATE,
    REPORT,
    PRETRAIN,
    DEPLOY,
)

DISPOSABLE_STAGES = (BATCH, FIT, SCORECARD, DIFFICULTY, RENDER, REPORT)
"""Stages whose artifacts only serve their own night: dropped when long unused."""
