"""What sweep k removes in a cell by closed integrals."""
