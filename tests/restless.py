"""The recharge project with a mission that begins anew when it ended: what of it fails while a part is gone is tried again."""

import os
import shutil


def restless_recharge(source, work):
    """A copy of it in the folder `work`, and its place."""
    project = os.path.join(work, "project")
    shutil.copytree(os.path.join(source, "examples", "recharge"), project)
    with open(os.path.join(project, "sentree.yaml"), "r+", encoding="utf-8") as file:
        text = file.read()
        assert "rate: 10 Hz}" in text
        file.seek(0)
        file.write(text.replace("rate: 10 Hz}", "rate: 10 Hz, repeat: true}"))
    return project
