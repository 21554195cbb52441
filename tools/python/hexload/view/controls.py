"""Buttons that command a live controller, by the commands of the bus."""

from hexload.view.live import Live
from hexload.view.page import Page

FILTERS = ("paper", "momentum")  # in the order of their codes


def add_controls(page: Page, live: Live, mass_kg: float) -> None:
    gui = page.server.gui
    page.controls_folder.visible = True
    with page.controls_folder:
        first = gui.add_button_group("Estimator", ("start", "stop", "reset"))
        anew = gui.add_button("Identify anew", hint="stop, then start: another load is on the platform")
        chosen = gui.add_dropdown("Filter", FILTERS, initial_value=FILTERS[1])
        select = gui.add_button("Use this filter", hint="stop, select filter, start")
        mass = gui.add_number("Load's mass, kg", mass_kg, min=0.0, step=0.1)
        known = gui.add_button("This mass is known", hint="stop, set known mass, start")
    first.on_click(lambda _: live.command(first.value))
    anew.on_click(lambda _: live.start_anew())
    select.on_click(lambda _: live.start_anew(("select filter", float(FILTERS.index(chosen.value)))))
    known.on_click(lambda _: live.start_anew(("set known mass", float(mass.value))))
