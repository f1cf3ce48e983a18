"""The language, declared once: `blocks` (mappings), `leaves` (values), and the JSON Schema made from them."""
