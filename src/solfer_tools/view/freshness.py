"""The banner about what is too old, which the page shows by itself, whatever has stopped."""

from viser import GuiHtmlHandle
from viser._messages import RunJavascriptMessage

from solfer_tools.view.server import PageServer


class Freshness:
    """Counts what is new on the page; a script there shows the banner while the count stands still.

    Args:
        server: The page.
    """

    _SCRIPT = """
clearInterval(window.solferWatch);
document.getElementById("solfer-banner")?.remove();
const banner = document.createElement("div");
banner.id = "solfer-banner";
banner.style.cssText = "display:none;position:fixed;top:0;left:0;right:0;z-index:99999;padding:0.5em;" +
  "background:#d00000;color:white;font:bold 1.2em sans-serif;text-align:center;pointer-events:none";
document.body.appendChild(banner);
let newest = null, since = performance.now();
window.solferWatch = setInterval(() => {
  const beat = document.getElementById("solfer-beat")?.dataset.count ?? null;
  if (beat !== newest) {
    if (beat !== null) since = performance.now();
    newest = beat;
  }
  const age = (performance.now() - since) / 1000;
  banner.style.display = age > 0.5 ? "block" : "none";
  banner.textContent = `what you see is ${age.toFixed(1)} s old`;
}, 100);
"""

    def __init__(self, server: PageServer):
        self._count = 0
        self._beat: GuiHtmlHandle = server.viser.gui.add_html(_beat(0))
        server.send(RunJavascriptMessage(self._SCRIPT))

    def beat(self) -> None:
        """Note that the page has something new."""
        self._count += 1
        self._beat.content = _beat(self._count)


def _beat(count: int) -> str:
    return f'<span id="solfer-beat" data-count="{count}"></span>'
