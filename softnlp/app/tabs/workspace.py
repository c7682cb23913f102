from nicegui import ui


def workspace_tab(stage):
    ui.label("x")
