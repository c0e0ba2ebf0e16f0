"""What a push does to a ring on a table at rest: impact, stick and slip from event to event, the free slide, resonance."""
