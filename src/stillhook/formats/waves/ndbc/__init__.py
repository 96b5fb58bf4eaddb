"""Files of the US National Data Buoy Center."""
