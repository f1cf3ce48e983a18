"""From recordings of one person to a profile: sizes, rest angles, noise, how long a limb holds."""
