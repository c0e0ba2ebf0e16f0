"""The record of doubts, beside the estimates that it is made of."""

from sdpgrind.base.doubts.record import Doubts as Doubts
