from nicegui import ui


def inverse_tab(stage):
    ui.label("x")
