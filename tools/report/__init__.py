"""Shared by all reports and pictures: style, page templates, and writing of files."""
