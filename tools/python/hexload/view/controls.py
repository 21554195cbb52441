"""Buttons that command a live controller, by the commands of the bus."""

from hexload.view.live import Live, Plant
from hexload.view.page import Page

GYRATION_M = 0.22  # of a load whose inertia nobody states: half a metre's cube
NO_FAULT, FORCE, VELOCITY = "none", "force offset", "velocity negated"

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
    _listen_to(live, first, anew, (chosen, select), (mass, known))


def _listen_to(live: Live, first, anew, of_filter: tuple, of_mass: tuple) -> None:
    (chosen, select), (mass, known) = of_filter, of_mass
    first.on_click(lambda _: live.command(first.value))
    anew.on_click(lambda _: live.start_anew())
    select.on_click(lambda _: live.start_anew(("select filter", float(FILTERS.index(chosen.value)))))
    known.on_click(lambda _: live.start_anew(("set known mass", float(mass.value))))


def add_plant_controls(page: Page, plant: Plant, mass_kg: float) -> None:
    """Of a simulator that runs by the clock: another load, and faults of its sensors."""
    gui = page.server.gui
    moment = mass_kg * GYRATION_M**2
    with page.controls_folder, gui.add_folder("Simulated machine", expand_by_default=False):
        mass = gui.add_number("Load, kg", mass_kg, min=0.0, step=1.0)
        com = gui.add_vector3("Centre of mass, m", (0.0, 0.0, 0.3), step=0.01)
        moments = gui.add_vector3("Ixx, Iyy, Izz, kg m²", (moment, moment, moment), min=(0.0, 0.0, 0.0), step=0.1)
        put_on = gui.add_button("Put this load on", hint="inertia about its centre of mass")
        leg = gui.add_dropdown("Leg", tuple("123456"))
        fault = gui.add_dropdown("Sensor fault", (NO_FAULT, FORCE, VELOCITY), initial_value=FORCE)
        offset = gui.add_number("Force offset, N", 200.0, step=10.0)
        inject = gui.add_button("Give the leg this fault")
    put_on.on_click(lambda _: plant.set_load(float(mass.value), com.value, moments.value))
    inject.on_click(
        lambda _: plant.set_sensor_fault(
            int(leg.value), float(offset.value) if fault.value == FORCE else 0.0, fault.value == VELOCITY
        )
    )
