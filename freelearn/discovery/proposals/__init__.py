"""What nobody wrote: where something unknown enters the chain, what it depends on, and in which closed form."""
