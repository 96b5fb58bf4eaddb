"""Electric drive: machine with its inverter, loops of the drive, DC link with store, winding temperature."""
