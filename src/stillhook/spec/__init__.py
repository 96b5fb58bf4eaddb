"""What a user writes: crane, scenario and lift, frozen and checked, every number with its unit and source."""
