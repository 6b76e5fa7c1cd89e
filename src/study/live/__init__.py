"""Web page that simulates reduced models in the browser."""
