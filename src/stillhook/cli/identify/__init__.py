"""Commands that identify friction, from supplier maps and from crane tests."""
