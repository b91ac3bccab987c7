"""What figures are made of: colours, arrows, marks, outlines, ticks and units."""
