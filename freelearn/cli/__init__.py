"""The commands: words of a shell to settings, the face, files and a terminal."""

import atexit
import gc

# What a command imports stays until it ends. Python would look for garbage in it again and again while it is loaded,
# and once more at the end: a third of a short command's time. A library leaves that to its host, as `import freelearn`
# does.
gc.set_threshold(50_000)
atexit.register(gc.freeze)
