"""Reports: text, figures and pages, views of a judgement."""
