"""What is shown of a vehicle, its field and its plan: sections of plain facts, made of `Situation`, `Plan` and the director's state.

Nothing here knows of a network; the page and the terminal show the same sections.
"""
