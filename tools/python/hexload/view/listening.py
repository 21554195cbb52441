"""A machine in operation, heard on a bus, on LCM, or on both: then the samples are the bus', the truth LCM's."""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager

from hexload import project
from hexload.view.live import Live


@contextmanager
def listened_to(
    bus: str | None, profile: str | None, url: str | None, tick_s: float = 1e-3, key: bytes | None = None
) -> Iterator[Live]:
    """`url`: LCM's; default, lcm and lcm:URL are such names too. `key`: of the controller on the bus, for commands. Raises
    InputError for a name, ToolFailed where there is no such bus, no codec or no LCM."""
    project.ensure_built("hexload_native")
    live = Live(f"live on {bus or 'LCM'}", tick_s)
    with ExitStack() as stack:
        if bus is not None:
            from hexload.view.bus_listener import BusListener

            listener = stack.enter_context(closing(BusListener(live, bus, profile or "fd", key)))
            live.sender = listener.send
        if url is not None:
            from hexload.view.lcm_listener import LcmListener, url_of

            lcm = stack.enter_context(closing(LcmListener(live, url_of(url), truth_alone=bus is not None)))
            live.sender, live.plant = live.sender or lcm.send, lcm
        yield live
