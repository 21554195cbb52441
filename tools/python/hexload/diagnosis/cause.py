"""What can be wrong: a defect, of a channel or of the machine, its load, its surroundings."""

from enum import StrEnum


class Channel(StrEnum):
    DISPLACEMENT = "displacement"
    VELOCITY = "velocity"
    FORCE = "force"
    SAMPLES = "samples"  # all three, row by row


CHANNELS = (Channel.DISPLACEMENT, Channel.VELOCITY, Channel.FORCE)


class Defect(StrEnum):
    # of a channel
    BURSTS = "bursts"
    CROSSTALK = "crosstalk"
    CURVE = "curve"
    DEAD = "dead"
    DERIVED = "derived"
    DRIFT = "drift"
    FROZEN = "frozen"
    GAIN = "gain"
    GAIN_STEP = "gain step"
    HELD = "held"
    HUM = "hum"
    HYSTERESIS = "hysteresis"
    LATE = "late"
    LOOSE = "loose"
    MISSING = "missing"
    NOISE = "noise"
    PERIODIC = "periodic"
    PULSE = "pulse"
    REPEATED = "repeated"
    SATURATED = "saturated"
    SIGN = "sign"
    SPIKES = "spikes"
    STEPS = "steps"
    STUCK = "stuck"
    SWAPPED = "swapped"
    UNIT = "unit"
    WRONG = "wrong"
    ZERO = "zero"
    ZERO_STEP = "zero step"
    # of the log's times and of what is stated
    CLOCK = "clock"
    CLOCK_JUMPED = "clock jumped"
    JITTER = "jitter"
    SAMPLING = "sampling"
    STATED_NOISE = "stated noise"
    # of the counting of the legs
    LEGS_EXCHANGED = "legs exchanged"
    LEGS_MIRRORED = "legs mirrored"
    LEGS_RENUMBERED = "legs renumbered"
    NO_POSE = "no pose"
    # of the machine
    DRY_FRICTION = "dry friction"
    ELASTIC_LEGS = "elastic legs"
    GRAVITY = "gravity"
    GROWING_FRICTION = "growing friction"
    HINGE_CIRCLE = "hinge circle"
    HINGE_FRICTION = "hinge friction"
    HINGES = "hinges"
    LEG_MASS = "leg mass"
    ONE_HINGE = "one hinge"
    TILT = "tilt"
    VISCOUS_FRICTION = "viscous friction"
    # of the load and of what is around it
    END_STOP = "end stop"
    EXTERNAL_FORCE = "external force"
    HOSES = "hoses"
    LOAD_CHANGE = "load change"
    LOAD_RAMP = "load ramp"
    NOT_RIGID = "not rigid"
    PUSH = "push"
    SHAKING_BASE = "shaking base"
    SPINNING_PART = "spinning part"


class Cause(str):
    """A defect, and the channel that has it where it is one of a channel; as text its key: "force gain", "dry friction"."""

    defect: Defect
    channel: Channel | None

    def __new__(cls, defect: Defect, channel: Channel | None = None):
        cause = super().__new__(cls, defect if channel is None else f"{channel} {defect}")
        cause.defect, cause.channel = defect, channel
        return cause

    def __getnewargs__(self) -> tuple[Defect, Channel | None]:
        return self.defect, self.channel

    @property
    def is_of_channels(self) -> bool:
        """Of sensors, their wiring, their times: not of the machine or its load."""
        return self.channel is not None or self.defect in (Defect.CLOCK, Defect.CLOCK_JUMPED)
