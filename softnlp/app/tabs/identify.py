from nicegui import ui


def identify_tab(stage):
    ui.label("x")
