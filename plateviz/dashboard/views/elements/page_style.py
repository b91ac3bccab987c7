"""Style of all Material UI components of the page."""

# The typeface of the figures, which every system has. That of Material UI is in 16 files without
# the ranges of their characters: the browser loads one after the other, and lays out the page anew
# after each.
_TYPE = {"fontSize": 13, "fontFamily": "Helvetica, Arial, sans-serif"}
# The bar has one line of words, and its height is missing below.
_LOW_BAR = {"minHeight": "48px !important"}
# Margins of a paragraph and of an empty title would move the words of an alert below its icon.
_ALERT_WORDS = {"& p": {"margin": 0}, "& .MuiAlertTitle-root:empty": {"display": "none"}}
# Labels of choices are otherwise smaller than those of entries, and than the gap in their frame.
_LABEL = {"fontSize": "13.8px !important", "lineHeight": "20px !important"}

PAGE_STYLE = {
    "typography": _TYPE,
    "components": {
        "MuiToolbar": {"styleOverrides": {"root": _LOW_BAR}},
        "MuiInputLabel": {"styleOverrides": {"root": _LABEL}},
        "MuiAlert": {"styleOverrides": {"message": _ALERT_WORDS}},
    },
}
"""As Material UI's theme has it."""
