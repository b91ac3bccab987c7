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
# A choice is as high as the entry beside it, whose own padding is larger, and whose label stands in
# it while it is empty; a text of several lines has no padding inside its frame.
_SMALL_ENTRY = "&.MuiInputBase-sizeSmall .MuiOutlinedInput-input:not(textarea)"
_ENTRY = {_SMALL_ENTRY: {"paddingTop": "6px", "paddingBottom": "6px"}}
_LABEL_INSIDE = {"transform": "translate(14px, 6px)"}

PAGE_STYLE = {
    "typography": _TYPE,
    "components": {
        "MuiToolbar": {"styleOverrides": {"root": _LOW_BAR}},
        "MuiOutlinedInput": {"styleOverrides": {"root": _ENTRY}},
        "MuiInputLabel": {
            "styleOverrides": {
                "root": {
                    **_LABEL,
                    "&.MuiInputLabel-sizeSmall:not(.MuiInputLabel-shrink)": _LABEL_INSIDE,
                }
            }
        },
        "MuiAlert": {"styleOverrides": {"message": _ALERT_WORDS}},
    },
}
"""As Material UI's theme has it."""
