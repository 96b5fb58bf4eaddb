"""The certificate of a twin."""
