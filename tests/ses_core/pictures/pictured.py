"""Drives to draw, and how to look at what was drawn."""

import io

import numpy as np
from PIL import Image

from ses_core.arrays import ByteArray
from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.extraction.trajectory import Trajectory
from ses_core.robot_profile import GENERIC, JACKAL
from ses_core.settings import ExtractionSettings
from tests.ses_core.extraction.drives import CORRIDOR, scanned_drive, straight

POINTS = straight(6.5)


def drive(*, reversing: bool = False) -> Trajectory:
    speed = np.full(len(POINTS), 0.5)
    if reversing:
        speed[50:120] = -0.2
    return scanned_drive(POINTS, CORRIDOR, speed=speed, beams=180)


def extracted(*drives: Trajectory) -> list[ExtractedScenario]:
    return extract(
        drives,
        log_id="log",
        recorded_map=None,
        settings=ExtractionSettings(),
        profile=GENERIC,
        target=JACKAL,
    )


def pixels(png: bytes) -> ByteArray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def draws(picture: ByteArray, color: str) -> int:
    """Count the pixels of a colour."""
    wanted = np.array([int(color[index : index + 2], 16) for index in (1, 3, 5)])
    return int((np.abs(picture.astype(int) - wanted).max(axis=2) <= 2).sum())
