"""What a lift is, before any winch: payload, rigging, deep wire, winch programme, water. Records, frozen; text with
units in, SI inside."""
