"""Style of what stands in the page's bar: words and buttons of one size, on one line."""

BAR_STYLE = """
button.in-bar { height: 30px; padding: 0 8px; border: 0; border-radius: 4px;
                font: 500 13px/30px Helvetica, Arial, sans-serif; letter-spacing: normal;
                color: #ffffff; background: transparent; cursor: pointer; }
button.in-bar:hover, button.in-bar:focus-visible { color: #ffffff;
                                                   background: rgb(255 255 255 / 20%); }
"""
"""Of the class "in-bar" of a button that is no Material UI one."""

IN_BAR = {
    "color": "inherit",
    "fontSize": "13px",
    "letterSpacing": "normal",
    "lineHeight": "30px",
    "minWidth": 0,
    "py": 0,
    "textTransform": "none",
    "whiteSpace": "nowrap",
}
"""Of a Material UI component, as its parameter `sx`."""
