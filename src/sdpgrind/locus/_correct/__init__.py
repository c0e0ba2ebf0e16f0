"""Where the model is wrong: a controller that corrects its constraints and cost by what it measures (modifier adaptation)."""
