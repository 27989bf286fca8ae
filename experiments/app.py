"""The application that commands register with."""

import tyro

app = tyro.extras.SubcommandApp()
