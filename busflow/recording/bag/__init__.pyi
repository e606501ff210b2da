from busflow.recording.bag.bag import Bag as Bag
