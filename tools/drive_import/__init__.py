"""A drive profile made from an EDS or DCF, with what such a file cannot tell."""
