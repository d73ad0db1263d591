"""Pictures: values in, the bytes of a figure out."""
