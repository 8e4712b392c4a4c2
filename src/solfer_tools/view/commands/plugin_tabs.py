"""A tab for each plugin: the state of its life, its figures, its parameters."""

import html
import json
import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from viser import (
    GuiApi,
    GuiCheckboxHandle,
    GuiEvent,
    GuiFolderHandle,
    GuiHtmlHandle,
    GuiSliderHandle,
    GuiTabHandle,
    GuiTextHandle,
)

from solfer.transport.health import Health
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import SWITCH_ONE, TRIGGER, Flag, HealthReport, NoFields
from solfer.transport.parameters import ParametersReply
from solfer_tools.view.commands.control import PageControl
from solfer_tools.view.commands.parameters import KnownParameters
from solfer_tools.view.commands.requests import PageRequests

Control = GuiSliderHandle[float] | GuiCheckboxHandle | GuiTextHandle


class PluginTabs:
    """Tabs of all parts that report their health.

    Args:
        gui: Where they are.
        requests: Calls services.
        parameters: Those of the parts.
        control: Says which page may switch plugins and change parameters; None: none may.
    """

    def __init__(self, gui: GuiApi, requests: PageRequests, parameters: KnownParameters, control: PageControl | None):
        self._gui = gui
        self._requests = requests
        self._parameters = parameters
        self._control = control
        self._group = gui.add_tab_group()
        self._tabs: dict[str, _PluginTab] = {}

    def update(self, reports: Mapping[str, HealthReport]) -> None:
        """Show what is reported."""
        for name, report in reports.items():
            if name not in self._tabs:
                tab = self._group.add_tab(name.rpartition("/")[2])
                self._tabs[name] = _PluginTab(
                    self._gui, tab, name, requests=self._requests, parameters=self._parameters, control=self._control
                )
            self._requests.carry_out(f"the tab of {name}", partial(self._tabs[name].show, report))


class _PluginTab:
    """One plugin."""

    def __init__(
        self,
        gui: GuiApi,
        tab: GuiTabHandle,
        name: str,
        requests: PageRequests,
        parameters: KnownParameters,
        *,
        control: PageControl | None,
    ):
        self._gui = gui
        self._tab = tab
        self._name = name
        self._requests = requests
        self._parameters = parameters
        self._control = control
        self._report: HealthReport | None = None
        self._reply: ParametersReply | None = None
        self._folder: GuiFolderHandle | None = None
        self._controls: dict[str, Control] = {}
        with tab:
            self._text: GuiHtmlHandle = gui.add_html("")

    def show(self, report: HealthReport) -> None:
        """Show a report, if it is new, and the parameters as they are known."""
        if report is not self._report:
            self._report = report
            self._text.content = _table(report)
        reply = self._parameters.known.get(self._name)
        if reply is None or reply is self._reply:
            return
        self._reply = reply  # first: one that cannot be shown fails once
        if self._folder is None:
            self._folder = self._add_folder()
        with self._folder:
            for index, name in enumerate(reply.names):
                if name not in self._controls:
                    self._controls[name] = self._make_control(name, reply, index)
        for name, value in zip(reply.names, reply.values, strict=True):
            control = self._controls[name]
            known = value if isinstance(control, GuiTextHandle) else json.loads(value)
            control.value = known  # type: ignore[misc]  # viser's own

    def _add_folder(self) -> GuiFolderHandle:
        """Add what only plugins have: they know their parameters."""
        with self._tab:
            buttons = self._gui.add_button_group("life", ("start", "stop", "abort"), disabled=self._control is None)
            folder = self._gui.add_folder("parameters", expand_by_default=False)

        @buttons.on_click
        async def _(event: GuiEvent[Any]) -> None:
            key = (self._name, event.client_id)
            self._requests.submit(key, partial(self._switch, event.client_id, buttons.value))

        return folder

    def _switch(self, client: int | None, verb: str) -> None:
        if self._control is None or not self._control.may_command(client):
            return
        if verb == "abort":
            self._requests.call(f"{self._name}/abort", TRIGGER, NoFields(), Answer)
        else:
            self._requests.call(f"{self._name}/switch", SWITCH_ONE, Flag(verb == "start"), Answer)

    def _make_control(self, name: str, reply: ParametersReply, index: int) -> Control:
        value = reply.values[index]
        unit = reply.units[index]
        description = reply.descriptions[index]
        label = f"{name} [{unit}]" if unit else name
        control: Control
        number = _number(value)
        usual = _number(reply.defaults[index])
        lower = _number(reply.minimums[index])
        upper = _number(reply.maximums[index])
        off = self._control is None
        if value in ("true", "false"):
            control = self._gui.add_checkbox(label, value == "true", disabled=off, hint=description)
        elif not any(math.isnan(each) for each in (number, lower, upper)):
            largest = max((abs(each) for each in (number, usual) if not math.isnan(each)), default=0.0)
            ratio = 4.0  # of the end of the slider to the larger one of value and default, if the parameter may have it
            upper = min(upper, ratio * largest or upper)
            lower = max(lower, -ratio * largest if largest else lower)
            step = (upper - lower) / 400
            control = self._gui.add_slider(label, lower, upper, step, number, disabled=off, hint=description)
        else:
            control = self._gui.add_text(label, value, disabled=off, hint=description)

        @control.on_update
        async def _(event: GuiEvent[Any]) -> None:
            if event.client is not None:
                key = (self._name, name, event.client_id)
                self._requests.submit(key, partial(self._set, event.client_id, name, control.value))

        return control

    def _set(self, client: int | None, name: str, value: bool | float | str) -> None:
        if self._control is not None and self._control.may_command(client):
            self._parameters.change(self._requests, self._name, name, value)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _table(report: HealthReport) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td style='text-align:right;padding-left:1em'>{_text(value)}</td></tr>"
        for name, value in report.values.items()
    )
    colors = {Health.GOOD: "#2b8a3e", Health.WARNING: "#e67700", Health.ERROR: "#c92a2a"}
    color = colors[report.level]
    head = f"<b style='color:{color}'>{report.level.name}</b> {html.escape(report.summary)}"
    return f"<div style='font-size:0.8em;padding:0.5em'>{head}<table>{rows}</table></div>"


def _text(value: float | str) -> str:
    return html.escape(value) if isinstance(value, str) else f"{value:.4g}"
