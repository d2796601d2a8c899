"""A headless Chromium, driven through its own driver: no library, one small piece of HTTP."""

import base64
import json
import os
import re
import shutil
import time
import urllib.request

from stage import PATIENCE


def is_there():
    return bool(shutil.which("chromedriver") and shutil.which("chromium"))


class Browser:
    """One window. The stage ends the driver, and so the browser."""

    def __init__(self, stage, profile, width=1400, height=1000):
        self.stage = stage
        driver = stage.start(["chromedriver", "--port=0"])
        pattern = r"started successfully on port (\d+)"
        stage.until("the driver of the browser", lambda: driver.says(pattern))
        self.base = f"http://127.0.0.1:{driver.says(pattern)[1]}"
        arguments = ["--headless", "--disable-gpu", f"--window-size={width},{height}"]
        arguments += [f"--user-data-dir={profile}", "--hide-scrollbars"]
        if os.geteuid() == 0:
            arguments.append("--no-sandbox")
        options = {"args": arguments, "binary": shutil.which("chromium")}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options,
                  "goog:loggingPrefs": {"browser": "ALL"}}
        session = self._say("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.base += "/session/" + session["sessionId"]

    def _say(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(self.base + path, data, headers, method=method)
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return json.load(answer)["value"]

    def open(self, url):
        self._say("POST", "/url", {"url": url})

    def run(self, script):
        """What a script returns."""
        return self._say("POST", "/execute/sync", {"script": script, "args": []})

    def text(self):
        """All that can be read on the page."""
        return re.sub(r"\s+", " ", self.run("return document.body.innerText"))

    def wait_for(self, what, holds):
        """Until the text of the page is as wanted; the seconds that took."""
        began = time.monotonic()
        while not holds(self.text()):
            assert time.monotonic() < began + PATIENCE, f"{what}, in vain:\n{self.text()}"
            time.sleep(0.05)
        return time.monotonic() - began

    def prefer(self, scheme):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        params = {"cmd": "Emulation.setEmulatedMedia", "params": {"features": features}}
        self._say("POST", "/goog/cdp/execute", params)

    def resize(self, width, height):
        params = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": True}
        command = {"cmd": "Emulation.setDeviceMetricsOverride", "params": params}
        self._say("POST", "/goog/cdp/execute", command)

    def screenshot(self, path):
        path.write_bytes(base64.b64decode(self._say("GET", "/screenshot")))

    def complaints(self):
        """What the page has written to the console as an error."""
        entries = self._say("POST", "/se/log", {"type": "browser"})
        return [entry["message"] for entry in entries if entry["level"] == "SEVERE"]

    def close(self):
        self._say("DELETE", "")
