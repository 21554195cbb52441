"""The package hexload: what its parts may import, and its interface on arrays."""

import ast
import importlib.metadata
import json
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

import hexload
from hexload import project
from hexload.estimation.tare import MachineTare
from hexload.io.log_file import LegLog
from hexload.theory import bound, chi_square
from hexload.theory.excitation import Limits
from hexload_dev import lock, sbom
from hexload_dev.requirements import canonical, chosen, read_lock, requirements

PACKAGE = project.ROOT / "tools" / "python" / "hexload"
DATA = project.ROOT / "tests" / "data"
UNKNOWN = DATA / "unknown_load.toml"


def imports_of(path):
    """Dotted names of all that a file imports, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def part_of(path):
    return path.relative_to(PACKAGE).parts[0]


@pytest.mark.parametrize(
    "forbidden, allowed",
    [
        ("hexload_dev", ()),
        ("hexload.campaign", ("campaign", "faults", "cli")),  # cli has their verbs
        ("hexload.faults", ("faults", "cli")),
        ("hexload.cli", ("cli",)),
        (
            "hexload.report",
            ("report", "campaign", "faults", "cli", "estimation"),
        ),  # a replay writes its page when it is asked to
        ("hexload.simulation", ("simulation", "campaign", "cli")),
    ],
)
def test_imports_go_one_way(forbidden, allowed):
    # GIVEN the sources of the package WHEN their imports are read THEN none outside the parts that may goes there
    for path in PACKAGE.rglob("*.py"):
        if part_of(path) not in allowed:
            wrong = [name for name in imports_of(path) if name == forbidden or name.startswith(forbidden + ".")]
            assert not wrong, f"{path}: {wrong}"


def test_theory_knows_neither_the_firmware_nor_files_of_runs():
    for path in (PACKAGE / "theory").glob("*.py"):
        parts = {name.split(".")[1] for name in imports_of(path) if name.startswith("hexload.")}
        assert parts <= {"errors", "theory", "io"}, path


def test_identifying_loads_no_package_but_numpy():
    # GIVEN a new process WHEN it has made an estimator THEN of the packages of the extras none is loaded
    script = f"import sys, hexload; hexload.Estimator({str(UNKNOWN)!r}); print(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in result.stdout.split()}
    extras = {
        "scipy",
        "rich",
        "typer",
        "jinja2",
        "can",
        "cantools",
        "lcm",
        "viser",
        "mcap",
        "asammdf",
        "dask",
        "distributed",
    }
    assert not loaded & extras


def test_every_public_name_is_there_and_documented():
    for name in hexload.__all__:
        assert getattr(hexload, name) is not None
        if callable(getattr(hexload, name)):
            assert getattr(hexload, name).__doc__, name


# The groups of packages


def test_demo_needs_no_package_of_tests_campaigns_or_optimisation():
    # GIVEN the lists of packages WHEN those of the demo are asked for THEN the large ones of other verbs are not in them
    projects = [project.ROOT / "pyproject.toml", project.ROOT / "tools" / "python" / "pyproject.toml"]
    names = {line.split()[0] for line in requirements(projects, ["cli", "build", "report"])}
    assert {"numpy", "jinja2", "nanobind"} <= names
    assert not names & {"scipy", "mujoco", "dask", "distributed", "pytest", "hypothesis", "ruff", "pillow", "hexload"}


def test_a_group_brings_those_that_it_names():
    projects = [project.ROOT / "pyproject.toml"]
    campaign, both = (set(requirements(projects, names)) for names in (["campaign"], ["report", "excite"]))
    assert both < campaign


# The lock file, and the list of what hexload is made with


@pytest.fixture(scope="module")
def locked():
    return read_lock(lock.LOCK.read_text())


def test_the_lock_has_every_package_of_every_group_and_each_with_its_hashes(locked):
    # GIVEN the groups of packages and the lock WHEN all that the groups need is looked up THEN nothing of the lock is left over
    # but what belongs to other machines, and every package has a hash (read_lock refuses one without)
    needed = chosen(locked, requirements(lock.PROJECTS, lock.groups()))
    assert needed == locked
    # and its packages are those that the tests run with, at those versions
    installed = {canonical(entry.name): entry.version for entry in importlib.metadata.distributions()}
    versions = {name: {package.version for package in locked if package.name == name} for name in installed}
    assert not {name: installed[name] for name in installed if versions[name] and installed[name] not in versions[name]}


def test_the_demo_gets_no_more_of_the_lock_than_it_needs(locked):
    names = {package.name for package in chosen(locked, requirements(lock.PROJECTS, ["cli", "build", "report"]))}
    assert {"numpy", "typer", "markupsafe"} <= names  # markupsafe: of jinja2
    assert not names & {"scipy", "mujoco", "dask", "pytest", "ruff", "cyclonedx-python-lib", "uv", "pandas"}


def test_a_package_without_a_hash_or_not_in_the_lock_is_refused(locked):
    with pytest.raises(ValueError, match="numpy 2.0.0: found no hash"):
        read_lock("numpy==2.0.0 \\\n    # via hexload\n")
    with pytest.raises(KeyError, match="hexload lock.*: nosuch"):
        chosen(locked, ["nosuch >=1"])


def test_the_bill_of_materials_fits_its_schema_and_names_what_is_there():
    # GIVEN this machine WHEN the list of what hexload is made with is written THEN it is CycloneDX 1.6
    found = sbom.document()
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(json.dumps(found)) is None
    # and it has Python packages with their hashes, Debian packages and the test framework, with licences
    by_name = {component["name"]: component for component in found["components"]}
    assert by_name["scipy"]["hashes"] and by_name["scipy"]["licenses"]
    assert by_name["libeigen3-dev"]["purl"].startswith("pkg:deb/")
    assert by_name["libeigen3-dev"]["licenses"] and by_name["unity"]["hashes"]
    assert found == sbom.document()


# The build


def test_a_finished_build_has_nothing_to_do():
    # GIVEN the build that runs this test WHEN ninja is asked whether CMake must run THEN it says no
    build = project.build_directory()
    asked = subprocess.run(["ninja", "-C", build, "-n", "build.ninja"], capture_output=True, text=True)
    assert "no work to do" in asked.stdout, asked.stdout


# The interface on arrays


@pytest.fixture(scope="module")
def log():
    return hexload.read_log(DATA / "multisine_eccentric.csv.gz")


def arrays(log: LegLog, rows=slice(None)):
    return log.t_s[rows], log.displacement_m[rows], log.velocity_m_s[rows], log.force_n[rows]


def unknown_machine():
    return hexload.Platform.of(UNKNOWN).theory()


def truth(name="multisine_eccentric"):
    return np.array(json.loads((DATA / f"{name}.truth.json").read_text())["segments"][-1]["theta"])


def test_sample_by_sample_and_over_a_log_are_the_same_bits(log):
    # GIVEN two seconds of a log WHEN an estimator takes its samples, and another the log
    rows = slice(2000)
    for kind in ("momentum", "momentum_effects"):
        estimator = hexload.Estimator(UNKNOWN, kind)
        steps = [estimator.step(*sample) for sample in zip(*arrays(log, rows)[1:])]
        run = hexload.replay(*arrays(log, rows), UNKNOWN, kind)
        # THEN values, sigmas, verdicts and covariance are the same
        assert np.array_equal([step.value for step in steps], run.value)
        assert np.array_equal([step.sigma for step in steps], run.sigma)
        assert tuple(step.verdict for step in steps) == run.verdict
        assert np.array_equal(estimator.covariance, run.covariance)
        assert steps[-1].names == run.names


def test_a_load_change_is_seen_sample_by_sample():
    # GIVEN a log in which a load is picked up WHEN its samples are taken THEN the change is found as over the log
    log = hexload.read_log(DATA / "load_pickup.csv.gz")
    rows = slice(5000, 7500)
    estimator = hexload.Estimator(UNKNOWN)
    for sample in zip(*arrays(log, rows)[1:]):
        estimator.step(*sample)
    found_s = hexload.replay(*arrays(log, rows), UNKNOWN).load_changes_s
    assert len(found_s) == 1
    assert estimator.load_changes_s == pytest.approx([found_s[0] - log.t_s[5000]], abs=1e-9)


def test_a_platform_is_a_file_a_dict_or_an_object(log):
    # GIVEN the same machine in four forms WHEN each identifies THEN all say the same
    tables = tomllib.loads(UNKNOWN.read_text())
    with_arrays = tables | {"geometry": {key: np.array(value) for key, value in tables["geometry"].items()}}
    forms = (UNKNOWN, str(UNKNOWN), with_arrays, hexload.Platform.of(UNKNOWN))
    first, *others = [hexload.identify(*arrays(log, slice(500)), form).value for form in forms]
    assert all(np.array_equal(first, other) for other in others)


def test_the_papers_filter_takes_the_known_mass_from_the_platform():
    log = hexload.read_log(DATA / "paper_noisy.csv.gz")
    load = hexload.identify(*arrays(log), DATA / "paper_load.toml")
    assert load.names == ("dz", "Ixx", "Iyy", "Izz")
    assert load.body is None
    assert load["dz"] == pytest.approx(0.3, abs=5 * load.sigma[0])
    assert hexload.Estimator(DATA / "paper_load.toml").covariance is None


def test_a_refused_sample_leaves_the_state_as_it_was(log):
    # GIVEN two estimators at the same sample WHEN one gets a sample that is not a number THEN it says so and goes on alike
    one, other = hexload.Estimator(UNKNOWN), hexload.Estimator(UNKNOWN)
    _, dl, vl, f = arrays(log, slice(100))
    for k in range(50):
        one.step(dl[k], vl[k], f[k])
        other.step(dl[k], vl[k], f[k])
    assert one.step(dl[50], vl[50], np.full(6, np.nan), tick=50) is None
    assert one.refused == 1
    assert one.last_refusal
    mine, its = (each.step(dl[51], vl[51], f[51], tick=51) for each in (one, other))
    assert np.array_equal(mine.value, its.value)


def test_a_refused_sample_leaves_the_legs_accelerations_as_they_were(log):
    # GIVEN two estimators with the tare of a platform whose legs have mass
    legs = MachineTare(project.native_module().Tare(*np.zeros((2, 10))), np.array([0.3, 0.5, 0.3]), unknown_machine())
    one, other = hexload.Estimator(UNKNOWN, tare=legs), hexload.Estimator(UNKNOWN, tare=legs)
    _, dl, vl, f = arrays(log, slice(60))
    # WHEN one gets velocities that are not numbers at ticks of which the other gets nothing
    for k in range(60):
        if k in (0, 30):
            assert one.step(dl[k], np.full(6, np.nan), f[k], tick=k) is None
            continue
        mine, its = (each.step(dl[k], vl[k], f[k], tick=k) for each in (one, other))
        # THEN both take all later samples, and say the same
        assert np.array_equal(mine.value, its.value)
        assert np.array_equal(mine.sigma, its.sigma)
    assert one.refused == 2


@pytest.mark.parametrize("every", [1, 2, 5])
def test_the_legs_mass_is_taken_off_a_sample_as_off_a_log(log, every):
    # GIVEN the tare of a platform whose legs have mass, and a log in ticks of 1, 2 and 5 ms
    legs = MachineTare(project.native_module().Tare(*np.zeros((2, 10))), np.array([0.3, 0.5, 0.3]), unknown_machine())
    t, *channels = arrays(log, slice(0, 4000, every))
    # WHEN it is identified from sample to sample and at once THEN both say the same to what float32 makes of a leg's way
    estimator = hexload.Estimator(UNKNOWN, sampling_s=1e-3 * every, tare=legs)
    for sample in zip(*channels):
        step = estimator.step(*sample)
    run = hexload.replay(t, *channels, UNKNOWN, tare=legs)
    assert (np.abs(step.value - run.value[-1]) < 1e-3 * step.sigma).all()
    # and not what they say without the legs
    without = hexload.replay(t, *channels, UNKNOWN)
    assert (np.abs(step.value - without.value[-1]) > 0.5 * step.sigma).any()


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda t, dl, vl, f: (t, dl[:, :5], vl, f), r"dl: found shape \(100, 5\), expected \(100, 6\)"),
        (lambda t, dl, vl, f: (t, dl, vl[:-1], f), r"vl: found shape \(99, 6\), expected \(100, 6\)"),
        (lambda t, dl, vl, f: (t[:1], dl[:1], vl[:1], f[:1]), r"t: found shape \(1,\), expected"),
        (lambda t, dl, vl, f: (t[::-1], dl, vl, f), r"t: row 1: found 0\.098, expected finite times, each later"),
        (
            lambda t, dl, vl, f: (t, dl, vl, np.where(np.arange(100)[:, None] == 7, np.inf, f)),
            r"f: row 7, leg 1: found inf",
        ),
    ],
)
def test_wrong_arrays_are_refused_by_name(log, change, message):
    with pytest.raises(hexload.InputError, match=message):
        hexload.replay(*change(*arrays(log, slice(100))), UNKNOWN)


def test_wrong_platforms_and_options_are_refused_by_name():
    with pytest.raises(hexload.InputError, match=r"^nowhere\.toml: found no such file, expected a platform file"):
        hexload.Estimator("nowhere.toml")
    with pytest.raises(hexload.InputError, match="geometry: found nothing"):
        hexload.Estimator({"platform": {}})
    with pytest.raises(hexload.InputError, match=r"unknown_load\.toml: load\.known_mass_kg: found nothing"):
        hexload.Estimator(UNKNOWN, "paper")
    with pytest.raises(hexload.InputError, match=r"estimator\.kind: found .*kalman"):
        hexload.Estimator(UNKNOWN, "kalman")
    with pytest.raises(hexload.InputError, match="tick: found 0, expected 1 or more"):
        estimator = hexload.Estimator(UNKNOWN)
        estimator.step(*np.zeros((3, 6)))
        estimator.step(*np.zeros((3, 6)), tick=0)


def test_the_tare_of_a_platform_that_is_as_its_file_says_is_nothing(log):
    # GIVEN a log of a load, and the platform that carries it as a file's own WHEN it is tared THEN there is no offset
    tables = tomllib.loads(UNKNOWN.read_text())
    load = truth()
    mass = tables["platform"]["mass_kg"] + load[0]
    together = np.array(tables["platform"]["inertia_kg_m2"]) + load[4:]
    tables["platform"] = {"mass_kg": mass, "com_m": (load[1:4] / mass).tolist(), "inertia_kg_m2": together.tolist()}
    found = hexload.tare(*arrays(log), tables)
    assert (np.abs(found.theta) < 5 * found.sigma).all()
    # and with it nothing is carried
    carried = hexload.identify(*arrays(log), tables, tare=found)
    assert (np.abs(carried.value) < 5 * carried.sigma).all()
    # while for the empty platform's file it is a load
    with pytest.raises(hexload.InputError, match="the platform seems to carry a load"):
        hexload.tare(*arrays(log), UNKNOWN)


def test_the_bound_is_that_of_the_formulas():
    # GIVEN a second of motion WHEN its bound is asked for THEN it is that of theory, with the platform file's noise
    t = np.linspace(0.0, 1.0, 1001)[:, None]
    rpy = 0.1 * np.sin(6.0 * t * [1.0, 1.3, 0.7])
    motion = hexload.Trajectory(
        0.05 * np.sin(5.0 * t * [1, 2, 3]), bound.rotation_from_rpy(rpy), np.cos(t * [1, 2, 3]), rpy
    )
    load = truth()
    prior = np.full(10, 100.0)
    found = hexload.crlb(UNKNOWN, motion, load, prior_sigma=prior)
    assert np.array_equal(found, bound.crlb(bound.read_platform(UNKNOWN), motion, load, bound.Sigmas(1e-3, 5.0), prior))
    with pytest.raises(hexload.InputError, match=r"theta: found shape \(3,\), expected \(10,\)"):
        hexload.crlb(UNKNOWN, motion, load[:3])


def test_a_motion_that_excites_is_found_within_the_limits():
    # GIVEN a load and limits WHEN a short search is made THEN the motion rests at both ends and keeps the stroke
    limits = Limits(-0.3, 0.3, 0.8, 3.0, 20_000.0, 0.5, 50.0, 1e-3)
    load = truth()
    found = hexload.excite(UNKNOWN, load, limits, duration_s=2.0, sines=3, starts=1, iterations=5)
    assert found.pose.shape == (2001, 6)
    assert np.allclose(found.pose[[0, -1]], 0.0, atol=1e-9)
    assert np.isfinite(found.relative_bound).all()
    native = project.native_module()
    platform = native.load_platform(str(UNKNOWN))
    for pose in found.pose[::50]:
        legs = native.leg_displacement(platform, pose[:3], native.rotation_from_rpy(pose[3:]))
        assert np.abs(legs).max() <= 0.3
    with pytest.raises(hexload.InputError, match="theta: found a load without mass"):
        hexload.excite(UNKNOWN, np.zeros(10), limits)


def test_quantiles_are_scipys():
    # GIVEN probabilities and degrees from one tick to a long run WHEN quantiles are compared THEN they agree to the
    # rounding of exp(a log z - z - lgamma(a)): a log z, up to 3e5 for 60,000 degrees, times 2^-53
    from scipy.stats import chi2

    for degrees in (1, 3, 6, 600, 60_000):
        for probability in (1e-6, 0.025, 0.5, 0.975, 0.999999):
            assert chi_square.quantile(probability, degrees) == pytest.approx(chi2.ppf(probability, degrees), rel=1e-10)
    with pytest.raises(ValueError, match="found probability 1 of 3 degrees"):
        chi_square.quantile(1.0, 3)
