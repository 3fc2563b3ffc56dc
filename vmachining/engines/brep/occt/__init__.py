"""OCCT: curves and surfaces, shells vertex by vertex, exact volume, booleans that are asked whether they worked, STEP."""
