import base64
import hashlib
import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ses_core.evaluation.label_agreement import label_agreement
from ses_core.robot_profile import JACKAL, TURTLEBOT4
from storage.night_report import NightReport
from storage.report_page import GALLERY_LIMIT, render_page, write_report
from tests.storage.nights import environments, full_night, quiet_night, untrained_night
from tests.storage.pages import Page, plain

NIGHTS = (full_night, untrained_night, quiet_night)


@pytest.fixture(scope="module")
def full_page() -> Page:
    return Page(render_page(full_night()))


@pytest.mark.parametrize("night", NIGHTS, ids=lambda item: item.__name__)
def test_page_needs_nothing_but_itself(night: Callable[[], NightReport]) -> None:
    html = render_page(night())
    for _, attributes in Page(html).tags:
        for name in ("src", "href", "srcset"):
            if name in attributes:
                assert str(attributes[name]).startswith("data:")
    assert "//" not in re.sub(r"base64,[A-Za-z0-9+/=]+|\n *//.*|\"cells\":\"[^\"]*\"", "", html)
    assert "@import" not in html
    assert "url(" not in html


def test_equal_reports_give_equal_pages() -> None:
    assert render_page(untrained_night()) == render_page(untrained_night())


def test_names_of_logs_and_robots_are_text_and_never_markup(full_page: Page) -> None:
    assert len(full_page.scripts) == 1
    assert "<script>alert('log')</script>.bag" in full_page.text
    assert 'jackal"7' in full_page.text


def test_hostile_identities_cannot_leave_their_data() -> None:
    hostile = "\"></script><script>x()</script><!-- '&\u2028"
    shown = tuple(
        replace(
            item,
            environment_id=hostile,
            scenario_id=hostile,
            site=hostile,
            robot=hostile,
            origin=hostile,
        )
        for item in environments(2, origin="h")
    )
    html = render_page(replace(quiet_night(), recorded=shown))
    page = Page(html)
    assert len(page.scripts) == 1
    assert "x()" not in page.text
    (data,) = page.galleries
    assert data["id"] == [hostile] * 2
    assert data["sites"] == data["robots"] == data["origins"] == [hostile]


def test_only_the_page_s_own_script_may_run(full_page: Page) -> None:
    (policy,) = [
        str(attributes["content"])
        for tag, attributes in full_page.tags
        if tag == "meta" and attributes.get("http-equiv") == "Content-Security-Policy"
    ]
    digest = base64.b64encode(hashlib.sha256(full_page.scripts[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy


def test_every_picture_is_a_whole_png(full_page: Page) -> None:
    images = full_page.images()
    assert len(images) == 8
    for content in images:
        with Image.open(io.BytesIO(content)) as image:
            image.load()
            assert image.format == "PNG"


def test_every_figure_has_a_twin_for_dark_pages(full_page: Page) -> None:
    sources = [attributes for tag, attributes in full_page.tags if tag == "source"]
    assert len(sources) == 8
    assert {item["media"] for item in sources} == {"(prefers-color-scheme: dark)"}


def test_galleries_hold_every_place_cell_for_cell(full_page: Page) -> None:
    night = full_night()
    for data, shown in zip(full_page.galleries, (night.recorded, night.synthesized), strict=True):
        packed = np.frombuffer(base64.b64decode(data["cells"]), dtype=np.uint8)
        planes = np.unpackbits(packed.reshape(len(shown), 2, 113), axis=2)[:, :, :900]
        squares = planes.reshape(-1, 2, 30, 30).astype(bool)
        assert np.array_equal(squares[:, 0], [item.cells for item in shown])
        assert np.array_equal(squares[:, 1], [item.observed for item in shown])
        assert data["id"] == [item.environment_id for item in shown]
        assert data["count"] == [item.count for item in shown]
        assert data["chosen"] == [int(item.is_chosen) for item in shown]
        assert [data["sites"][number] for number in data["site"]] == [item.site for item in shown]
    assert full_page.galleries[0]["words"] == "steps with v < 0"


def test_table_shows_what_the_paper_shows_and_what_it_leaves_out(full_page: Page) -> None:
    text = plain(full_page)
    for words in (
        "Policy Success Time of successes Restricted time Collision Time-out Stuck BARN score",
        "night-1f2e3d 71.2 % 71 to 83 27.3 s 25.0 to 30.2 48.4 s 40.0 to 55.5 20.0 % 5.0 % 3.8 %",
        "dwa-slow 0.0 % none 48.4 s",
        "+3.1 points -4.2 to +10.9 -2.4 s -6.1 to +1.2",
    ):
        assert words in text


def test_page_says_what_was_refused_reused_and_decided(full_page: Page) -> None:
    text = plain(full_page)
    for words in (
        "This is a demonstration, not evidence: 12,400 decisions trained",
        "12 held-out worlds, at least 100 are needed.",
        "broken & cut.bag the file ends early or is damaged inside truncated",
        "odd.bag bad clock bad_clock",
        "4 known from earlier nights, 1 still arriving",
        "jackal-7 home-3 rosbag2 mcap 1 h 02 min 812 m 91 7",
        "second.mcap scan dropout: 3, pose jump: 1",
        "100 environments by pca (asked for: gan): 131 samples drawn, 23.7 % of them",
        "2 passed over as repeats, 6 because a repair would change too many cells.",
        "can be crossed: 23 were repaired, with 4.2 cells cleared on average. 5 equal",
        "99 principal components instead of 100",
        "Do these environments stand for those?",
        "76.3 % of all samples drawn can be crossed",
        "precision cells (Hamming), k=5; 30 real, 30 synthesized 41.2 % 38.0 to 45.0 62.0 % "
        "55.0 to 70.0 high too low",
        "Made by pca instead of gan.",
        "train 1 2 1 min 11 s",
        "pool selection/ab12",
        "1 robot gave 80 % of the pool.",
        "challenging 84 261",
    ):
        assert words in text, words


def test_a_night_without_training_shows_its_funnel_and_no_empty_sections() -> None:
    text = Page(render_page(untrained_night())).text
    assert "From logs to training environments" in text
    assert "20261101-77" in text
    for heading in (
        "Training",
        "On worlds it has never seen",
        "What the policy was trained in",
        "Do these environments stand for those?",
        "demonstration",
        "Refused",
        "Where robots struggled",
    ):
        assert heading not in text


def test_the_page_says_which_robot_it_is_for_and_shows_its_footprint() -> None:
    jackal, turtlebot = (
        render_page(replace(full_night(), robot=robot)) for robot in (JACKAL, TURTLEBOT4)
    )
    assert "0.42 m long and 0.33 m wide, laser of 720 beams over 270°" in Page(jackal).text
    assert "For the robot turtlebot4 : round, 0.38 m across" in plain(Page(turtlebot))
    assert "laser of 720 beams over 360°" in Page(turtlebot).text
    assert "For the robot jackal" in plain(Page(jackal))
    shown = [
        {attributes["src"] for tag, attributes in Page(html).tags if tag == "img"}
        for html in (jackal, turtlebot)
    ]
    assert len(shown[0] ^ shown[1]) == 2
    named = replace(quiet_night(), robot=JACKAL.model_copy(update={"name": "<b>x</b>"}))
    assert "<b>x" not in render_page(named)


def test_a_night_without_logs_is_a_short_page() -> None:
    html = render_page(quiet_night())
    assert "No new log came in." in Page(html).text
    assert len(html) < 10_000


def test_an_evaluation_without_worlds_says_that_nothing_was_measured() -> None:
    night = full_night()
    assert night.evaluation is not None
    empty = replace(night.evaluation, rows=(), comparisons=(), worlds=0, episodes=())
    text = Page(render_page(replace(night, evaluation=empty))).text
    assert "No world was held out, so nothing was measured." in text


def test_a_long_gallery_is_cut_and_counted() -> None:
    few = environments(50, origin="c", counted=True)
    many = tuple(
        replace(few[index % 50], environment_id=f"e{index:015d}")
        for index in range(GALLERY_LIMIT + 40)
    )
    html = render_page(replace(quiet_night(), recorded=many))
    page = Page(html)
    (data,) = page.galleries
    assert len(data["id"]) == GALLERY_LIMIT
    assert f"{GALLERY_LIMIT:,} of {GALLERY_LIMIT + 40:,}" in page.text
    assert len(html) < 1_600_000


def test_a_full_page_stays_small(tmp_path: Path) -> None:
    path = tmp_path / "index.html"
    write_report(path, full_night())
    assert path.stat().st_size < 1_000_000
    assert path.read_text(encoding="utf-8") == render_page(full_night())


def test_the_page_sets_verified_difficulty_beside_the_log(full_page: Page) -> None:
    assert "Are they as hard as the log says?" in full_page.text
    words = plain(full_page)
    assert "home-0 6 1.00 16.7 % of 6" in words
    assert "<b>home</b> 6 -1.00 66.7 % of 6" in words
    assert "original , the policy that is gone on from, drove again" in words
    assert "12 recorded places, 3 times each. Of those that the log calls" in words
    assert "calls challenging, 41.7 % were hard again; of 100 synthesized" in words


def test_a_night_that_verified_nothing_says_nothing_of_it() -> None:
    html = render_page(replace(full_night(), difficulty=None))
    assert "Are they as hard" not in html
    assert html.count("data:image/png") == render_page(full_night()).count("data:image/png") - 2


def test_a_night_without_recorded_places_shows_no_scatter() -> None:
    night = full_night()
    assert night.difficulty is not None
    none = np.zeros(0)
    bare = replace(
        night.difficulty,
        logged=none,
        simulated=none,
        whole=label_agreement(none, none, threshold=50.0),
        sites={},
    )
    page = Page(render_page(replace(night, difficulty=bare)))
    assert "of 100 synthesized environments, 25.0 % were as hard" in plain(page)
    assert "Rank correlation" not in page.text
    assert len(page.images()) == 7
