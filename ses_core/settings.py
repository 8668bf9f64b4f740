"""Every setting of a night, one frozen model per stage; defaults are the paper's numbers."""

from typing import Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from ses_core.difficulty_settings import DifficultySettings
from ses_core.fleet_settings import FleetSettings
from ses_core.imperfections import Imperfections, PresetName
from ses_core.robot_profile import JACKAL, KNOWN_PROFILES, RobotProfile
from ses_core.scorecard_settings import ScorecardSettings
from ses_core.settings_model import SettingsModel
from ses_core.synthesis_settings import SynthesisSettings


class RobotRule(SettingsModel):
    """Which robots a profile is for."""

    match: str = Field(
        description="Shell pattern on '<site>/<robot>/<log name>', e.g. '*/neato*/*'."
    )
    profile: str = Field(description="Name of the profile these robots have.")


class DecoderLimits(SettingsModel):
    """What the child process that decodes one log may use; a log that needs more is refused."""

    memory_mib: int = Field(2048, ge=1024, description="Address space.")
    wall_s: float = Field(600.0, gt=0, description="Wall clock.")
    cpu_s: int = Field(600, ge=1, description="Processor time.")
    log_mib: int = Field(8192, ge=1, description="Size of the log on disk.")
    output_mib: int = Field(4096, ge=1, description="Size of what is decoded from it.")
    message_mib: int = Field(64, ge=1, description="Size of one message.")


class IngestSettings(SettingsModel):
    """How logs are recognised, decoded and put on the 20 Hz clock."""

    identity_pattern: str | None = Field(
        None,
        description="Regular expression on the path below the inbox with groups 'site' and "
        "'robot'; without it the folders '<site>/<robot>/' say so.",
    )
    robots: tuple[RobotRule, ...] = Field((), description="First rule that matches decides.")
    profiles: dict[str, RobotProfile] = Field(
        default_factory=dict, description="Profiles beside the built-in ones."
    )
    default_profile: str = Field("generic", description="Profile of robots that no rule names.")
    pose_source: Literal["odometry", "map"] = Field(
        "odometry", description="Pose in the odometry frame, or map -> base where the log has it."
    )
    velocity_source: Literal["auto", "commanded", "measured", "derived"] = Field(
        "auto",
        description="Which velocity counts; 'auto': commanded, else measured, else from poses.",
    )
    step_rate_hz: float = Field(20.0, gt=0, description="Clock of a trajectory (move_base's rate).")
    gap_s: float = Field(
        5.0, gt=0, description="Longer without a pose cuts the trajectory (dropout)."
    )
    steady_s: float = Field(
        60.0, ge=0, description="A file younger than this may still be arriving: it is waited for."
    )
    limits: DecoderLimits = DecoderLimits()


class ExtractionSettings(SettingsModel):
    """Trajectories to scenarios to 30 x 30 environments (section III-B, Algorithm 2)."""

    distance_m: float = Field(
        5.0, gt=0, description="Straight-line distance that, once exceeded, closes a scenario."
    )
    not_forward_speed_mps: float = Field(
        0.05, ge=0, description="At or below this speed a step counts as not moving forward."
    )
    source: Literal["auto", "scan", "map"] = Field(
        "auto", description="Rebuild places from scans, a map, or a map where there is one."
    )
    site_maps: dict[str, str] = Field(
        default_factory=dict,
        description="map_server YAML file of a site, by the site's name; used for logs whose "
        "poses are in the frame of the map.",
    )
    unknown: Literal["free", "occupied"] = Field(
        "free", description="What a cell that no beam reached counts as."
    )
    hit_share: float = Field(
        0.25, gt=0, lt=1, description="Occupied from this share of hits among its beams."
    )
    hit_minimum: int = Field(
        2, ge=1, description="Hits that occupy a cell; one, where no beam ever looked through."
    )
    scan_margin_s: float = Field(
        1.0, ge=0, description="Scans this long before and after a scenario are used and kept."
    )


class FilterSettings(SettingsModel):
    """Which scenarios are challenging, and how many days of them make the pool."""

    count_kind: Literal["negative", "not-forward", "reversing-seconds"] = Field(
        "negative",
        description="Steps with v < 0 (the paper's text), steps with v <= 0.05 m/s (what its "
        "authors' code counts), or seconds of reversing.",
    )
    threshold: float = Field(50.0, ge=0, description="Challenging is a count strictly above this.")
    challenging_share: float | None = Field(
        None, gt=0, le=1, description="Instead of the threshold: this share, hardest first."
    )
    window_days: int = Field(
        30, ge=1, description="Days of logs in the pool, up to the last batch."
    )
    per_robot_limit: int = Field(
        1000, ge=1, description="Most environments one robot may put into the pool."
    )
    heldout_share: float = Field(
        0.25, ge=0, lt=1, description="Share of the sites held out for evaluation, by their hash."
    )
    heldout_limit: int = Field(
        200, ge=1, description="Most held-out environments measured on, hardest first."
    )
    min_path_in_free_fraction: float = Field(
        0.9, ge=0, le=1, description="Least share of the robot's own path in free cells."
    )
    min_observed_fraction: float = Field(
        0.25, ge=0, le=1, description="Least share of cells seen; a corridor shows about 0.4."
    )
    max_contradicted_fraction: float = Field(
        0.5, ge=0, le=1, description="Most beam ends that other beams saw through (lost poses)."
    )


class SimulationSettings(SettingsModel):
    """Rates, rules and imperfections of the simulated robot."""

    control_rate_hz: float = Field(20.0, gt=0, description="Planner ticks (controller_frequency).")
    sensing_rate_hz: float = Field(5.0, gt=0, description="Scans, costmap and plan updates.")
    imperfections: PresetName | Imperfections = Field(
        "real", description="A preset, or levels of your own."
    )
    known_map: bool = Field(
        False, description="The costmap begins with every wall, else with nothing."
    )
    footprint_clearing: bool = Field(
        True, description="The robot forgets obstacles it stands on (costmap_2d's default)."
    )
    time_limit_s: float = Field(100.0, gt=0, description="An episode ends here as a time-out.")
    success_radius_m: float = Field(1.0, gt=0, description="This near the goal is a success.")
    collisions_end: bool = Field(True, description="Contact ends the episode; else it backs off.")
    stuck_distance_m: float = Field(0.4, ge=0, description="Less than this moved ...")
    stuck_time_s: float = Field(40.0, gt=0, description="... within this time is stuck.")


class TrainingSettings(SettingsModel):
    """Fine-tuning of the parameter policy (APPLR)."""

    algorithm: Literal["ppo", "td3", "sac"] = Field("ppo", description="stable-baselines3's.")
    steps: int = Field(100_000, ge=1, description="Decisions trained.")
    action: Literal["seven", "eight"] | None = Field(
        None,
        description="What is set: seven parameters, or with the weight of obstacles eight; else "
        "what the policy gone on from sets, or seven.",
    )
    decision_period_s: float | None = Field(
        None,
        gt=0,
        description="Driving between two decisions, in whole control ticks; else that of the "
        "policy gone on from, or 1 s.",
    )
    seed: int = Field(0, ge=0, description="Seed of weights, exploration and simulation.")
    learning_rate: float | None = Field(None, gt=0, description="Else the algorithm's preset.")
    gamma: float = Field(0.98, gt=0, lt=1, description="Discount per decision.")
    failure_penalty: float | None = Field(
        None, ge=0, description="Taken off when an episode fails; else the preset's."
    )
    collision_weight: float | None = Field(
        None,
        ge=0,
        description="Nearness within 0.3 m costs this / (nearness + 0.05 m); else the preset's.",
    )
    parallel_envs: int = Field(100, ge=1, description="Worlds stepped together.")
    preset: Literal["default", "authors", "paper"] = Field(
        "default",
        description="Reward, constants of TD3 and SAC, and the observation and network of a "
        "policy without a parent: ours, those of the authors' code, or those of APPLR.",
    )
    checkpoint_steps: int = Field(
        25_000,
        ge=1,
        description="Decisions between two checkpoints, at which all robots start anew.",
    )
    replay_share: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="Share of a fine-tuning's episodes in the original policy's worlds, against "
        "forgetting.",
    )
    keep_critic: bool = Field(
        False, description="Go on with the parent's critic too, where one is kept beside it."
    )
    critic_share: float = Field(
        0.1, ge=0, lt=1, description="Share of a fine-tuning that trains a new critic alone."
    )
    start_yaw_jitter_rad: float = Field(
        0.3, ge=0, description="A start is turned by up to this, either way."
    )
    start_sideways_jitter_m: float = Field(
        0.1, ge=0, description="A start is shifted by up to this, either way."
    )
    simulator: Literal["batch", "bullet"] = Field("batch", description="Where it is trained.")
    difficulty: Literal["ignore", "weigh", "filter"] = Field(
        "ignore",
        description="'weigh' draws an environment the more often the longer the policy gone on "
        "from takes in it, 'filter' never one that it always crosses without backing up.",
    )


class EvaluationSettings(SettingsModel):
    """Paired trials on worlds that the policy has never seen."""

    pairs: int = Field(5, ge=1, description="Start-goal pairs per world larger than a scenario.")
    trials: int = Field(4, ge=1, description="Trials per pair and policy, each with its own seed.")
    min_distance_m: float = Field(6.6, gt=0, description="Least straight start-goal distance.")
    pair_preset: Literal["default", "long"] = Field(
        "default",
        description="'long': start and goal also nearly as far apart as any two places of the "
        "world, which gives several scenarios a drive.",
    )
    seed: int = Field(0, ge=0, description="Seed of pairs and trials; the same for all policies.")
    simulator: Literal["batch", "bullet"] = Field("batch", description="Where it is measured.")
    spot_checks: int = Field(3, ge=0, description="Worlds repeated in PyBullet every night.")


class StoreSettings(SettingsModel):
    """The disk."""

    free_floor_mib: int = Field(1024, ge=0, description="Refuse to start below this free space.")
    scan_retention_days: int = Field(90, ge=1, description="Scans older than this may be dropped.")
    artifact_retention_days: int = Field(
        90, ge=1, description="Fits, worlds and reports older than this may be dropped."
    )


class Settings(SettingsModel):
    """Everything a night depends on."""

    ingest: IngestSettings = IngestSettings()
    extraction: ExtractionSettings = ExtractionSettings()
    filter: FilterSettings = FilterSettings()
    synthesis: SynthesisSettings = SynthesisSettings()
    simulation: SimulationSettings = SimulationSettings()
    training: TrainingSettings = TrainingSettings()
    evaluation: EvaluationSettings = EvaluationSettings()
    fleet: FleetSettings = FleetSettings()
    scorecard: ScorecardSettings = ScorecardSettings()
    difficulty: DifficultySettings = DifficultySettings()
    store: StoreSettings = StoreSettings()
    target_robot: RobotProfile = Field(
        JACKAL, description="The robot that is trained: a profile, or the name of one."
    )

    @field_validator("target_robot", mode="before")
    @classmethod
    def _named_profile(cls, value: object, info: ValidationInfo) -> object:
        """Look a profile up where only its name is given."""
        if not isinstance(value, str):
            return value
        ingest = info.data.get("ingest", IngestSettings())
        profiles = {**KNOWN_PROFILES, **ingest.profiles}
        if value not in profiles:
            raise ValueError(f"no robot profile has that name, expected {', '.join(profiles)}")
        return profiles[value]

    @model_validator(mode="after")
    def _difficulty_is_known(self) -> Self:
        """Refuse to train by a difficulty that nobody verifies."""
        if self.training.difficulty != "ignore" and not self.difficulty.trials:
            raise ValueError(
                f"training.difficulty is {self.training.difficulty!r} and difficulty.trials is 0, "
                "expected at least 1 trial"
            )
        return self
