"""A tab for each plugin: the state of its life, its parameters, its figures."""

import html
import json
import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from viser import (
    ClientHandle,
    GuiApi,
    GuiCheckboxHandle,
    GuiEvent,
    GuiFolderHandle,
    GuiHtmlHandle,
    GuiSliderHandle,
    GuiTabHandle,
    GuiTextHandle,
    Icon,
    IconName,
)

from solfer.config.records.live import saved
from solfer.transport.health import Health
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import SWITCH_ONE, TRIGGER, Flag, HealthReport, NoFields
from solfer.transport.parameters import ParametersReply
from solfer_tools.view.commands.control import PageControl
from solfer_tools.view.commands.parameters import KnownParameters
from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.status_bar import COLORS

ICONS: dict[Health, IconName | None] = {
    Health.GOOD: None,
    Health.WARNING: Icon.ALERT_TRIANGLE,
    Health.ERROR: Icon.ALERT_OCTAGON,
}
"""On the tab of a plugin."""

LAST = 1e9
"""Order of what is below all else in a tab."""

Control = GuiSliderHandle[float] | GuiCheckboxHandle | GuiTextHandle


class PluginTabs:
    """Tabs of all parts that report their health.

    Args:
        gui: Where they are.
        requests: Calls services.
        parameters: Those of the parts.
        control: Says which page may switch plugins and change parameters; None: none may.
        display: Gets the widgets that command nothing, see `IncomingMessages`.
    """

    def __init__(
        self,
        gui: GuiApi,
        requests: PageRequests,
        parameters: KnownParameters,
        control: PageControl | None,
        *,
        display: set[str],
    ):
        self._gui = gui
        self._display = display
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
                    self._gui,
                    tab,
                    name,
                    requests=self._requests,
                    parameters=self._parameters,
                    control=self._control,
                    display=self._display,
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
        display: set[str],
    ):
        self._gui = gui
        self._display = display
        self._tab = tab
        self._name = name
        self._requests = requests
        self._parameters = parameters
        self._control = control
        self._report: HealthReport | None = None
        self._reply: ParametersReply | None = None
        self._folder: GuiFolderHandle | None = None
        self._changes: GuiHtmlHandle | None = None
        self._controls: dict[str, Control] = {}
        with tab:
            self._state: GuiHtmlHandle = gui.add_html("")
            with gui.add_folder("figures", expand_by_default=False, order=LAST):
                self._figures: GuiHtmlHandle = gui.add_html("")

    def show(self, report: HealthReport) -> None:
        """Show a report, if it is new, and the parameters as they are known."""
        if report != self._report:
            self._report = report
            self._state.content = _state(report)
            self._figures.content = _table(report)
            if self._tab.icon != ICONS[report.level]:
                self._tab.icon = ICONS[report.level]
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
        assert self._changes is not None
        self._changes.content = _changes(reply)

    def _add_folder(self) -> GuiFolderHandle:
        """Add what only plugins have: they know their parameters."""
        off = self._control is None
        gui = self._gui
        with self._tab:
            buttons = gui.add_button_group("life", ("start", "stop", "abort"), disabled=off)
            folder = gui.add_folder("parameters", expand_by_default=False)
        with folder:
            search = gui.add_text("search", "", hint="shows the parameters whose names contain this, on all pages")
            self._changes = gui.add_html("")
            reset = gui.add_button("reset", disabled=off, hint="gives all changed parameters their configured values")
            save = gui.add_button("save", hint="downloads what is changed as YAML, for secondary_file")
        self._display.add(search._impl.uuid)

        @buttons.on_click
        async def _(event: GuiEvent[Any]) -> None:
            key = (self._name, event.client_id)
            self._requests.submit(key, partial(self._switch, event.client_id, buttons.value))

        @search.on_update
        async def _(_: object) -> None:
            self._requests.submit((self._name, "search"), partial(self._search, search.value))

        @reset.on_click
        async def _(event: GuiEvent[Any]) -> None:
            self._requests.submit((self._name, "reset"), partial(self._reset, event.client_id))

        @save.on_click
        async def _(event: GuiEvent[Any]) -> None:
            if event.client is not None:
                self._requests.submit((self._name, "save", event.client_id), partial(self._save, event.client))

        return folder

    def _search(self, part: str) -> None:
        for name, control in self._controls.items():
            control.visible = part.lower() in name.lower()

    def _reset(self, client: int | None) -> None:
        assert self._reply is not None
        if self._control is not None and self._control.may_command(client):
            changed = {name: configured for name, _, configured in _changed(self._reply)}
            self._parameters.change(self._requests, self._name, changed)

    def _save(self, client: ClientHandle) -> None:
        assert self._reply is not None
        module = self._name.rpartition("/")[2]
        values = {name: (value, configured) for name, value, configured in _changed(self._reply)}
        text, _ = saved("", f"{module}.yaml", module, values=values)
        client.send_file_download(f"{module}.yaml", text.encode())

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
        description = f"{reply.descriptions[index]} (default: {reply.defaults[index] or 'none'})"
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
            self._parameters.change(self._requests, self._name, {name: value})


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _changed(reply: ParametersReply) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and configured value of the parameters that have been changed."""
    configured = reply.configured or reply.defaults  # of other programs, which may know only these
    for name, value, before in zip(reply.names, reply.values, configured, strict=True):
        if value != before and not (_number(value) == _number(before)):
            yield name, value, before


def _changes(reply: ParametersReply) -> str:
    rows = [
        f"<li>{html.escape(f'{name}: {value}, configured {before}')}</li>" for name, value, before in _changed(reply)
    ]
    text = f"changed:<ul style='margin:0'>{''.join(rows)}</ul>" if rows else "nothing is changed"
    return f"<div style='font-size:0.8em;padding:0 1em'>{text}</div>"


def with_pipes(reports: Mapping[str, HealthReport]) -> dict[str, HealthReport]:
    """Return the reports of all parts but pipes, each with a sentence of each of its pipes among its figures."""
    parts = {name: report for name, report in reports.items() if " " not in name}
    sentences: dict[str, dict[str, str]] = {}
    for name, report in reports.items():
        part, _, pipe = name.partition(" ")
        if pipe and part.rstrip(":") in parts:
            sentences.setdefault(part.rstrip(":"), {})[pipe] = f"{report.level.name}: {report.summary}"
    for part, pipes in sentences.items():
        report = parts[part]
        parts[part] = HealthReport(report.level, report.summary, {**report.values, **pipes})
    return parts


def _state(report: HealthReport) -> str:
    head = f"<b style='color:{COLORS[report.level]}'>{report.level.name}</b> {html.escape(report.summary)}"
    return f"<div style='font-size:0.8em;padding:0.5em'>{head}</div>"


def _table(report: HealthReport) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td style='text-align:right;padding-left:1em'>{_text(value)}</td></tr>"
        for name, value in report.values.items()
    )
    return f"<table style='font-size:0.8em;padding:0.5em'>{rows}</table>"


def _text(value: float | str) -> str:
    if isinstance(value, str):
        return html.escape(value)
    is_count = abs(value) < 1e15 and value == round(value)
    return f"{value:.0f}" if is_count else f"{value:.4g}"
