"""The program `hexload` of an installed package."""

import sys

# Top-level modules that an extra brings.
EXTRAS = {
    "typer": "cli",
    "rich": "cli",
    "jinja2": "report",
    "scipy": "excite",
    "can": "bus",
    "cantools": "bus",
    "lcm": "bus",
    "cryptography": "bus",
    "dask": "campaign",
    "distributed": "campaign",
    "viser": "view",
    "websockets": "view",
}


def main() -> None:
    """Runs a verb; a package that is missing is named with the extra that brings it, status 1."""
    try:
        from hexload.cli.app import main as run

        run()
    except ModuleNotFoundError as error:
        name = (error.name or "").split(".")[0]
        if name not in EXTRAS:
            raise
        print(f"hexload: found no package {name}, expected it: pip install 'hexload[{EXTRAS[name]}]'", file=sys.stderr)
        sys.exit(1)
