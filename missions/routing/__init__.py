"""Routes in the plane: drawn, searched for so that they can be driven, or refused with what stands in the way."""
