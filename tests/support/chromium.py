"""The browser of the tests that need one."""

PATH = "/usr/bin/chromium"
# Headless and quiet: the browser itself asks nobody on the network for anything.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
