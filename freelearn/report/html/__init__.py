"""Pages, and the charts by Bokeh in them."""
