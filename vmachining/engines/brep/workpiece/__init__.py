"""The workpiece as one valid solid whose faces know their block, and which parts of a cutting edge lie in it."""
