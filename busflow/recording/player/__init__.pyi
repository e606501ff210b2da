from busflow.recording.player.player import Player as Player
