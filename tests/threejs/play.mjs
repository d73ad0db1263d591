// A scene at a time of a clip, as three's AnimationMixer shows it.

// Returns seek(time), which poses the whole scene; without a clip the scene rests.
export function player(three, { root, nodes }, rest, clip) {
  rest.restore();
  const mixer = new three.AnimationMixer(root);
  const action = clip && mixer.clipAction(clip).play();
  return (time) => {
    if (action) action.time = time; // not mixer.setTime, which wraps the end around to the start
    mixer.update(0);
    root.updateMatrixWorld(true);
    for (const node of nodes) if (node && !node.parent) node.updateMatrixWorld(true);
  };
}

// Returns {restore}, which puts every node and morph weight back to where it is now.
export function resting({ root }) {
  const kept = [];
  root.traverse((object) => {
    const { position, quaternion, scale, morphTargetInfluences: weights } = object;
    kept.push([object, position.clone(), quaternion.clone(), scale.clone(), weights && [...weights]]);
  });
  return {
    restore() {
      for (const [object, position, quaternion, scale, weights] of kept) {
        object.position.copy(position);
        object.quaternion.copy(quaternion);
        object.scale.copy(scale);
        if (weights) object.morphTargetInfluences.splice(0, weights.length, ...weights);
      }
    },
  };
}

// Returns the times to look at, in seconds: `rate` a second from 0, the end, and every key of the clips.
export function times(clips, rate) {
  const end = Math.max(0, ...clips.map((clip) => clip.duration));
  const found = new Set([0, end]);
  for (let i = 1; i / rate < end; i++) found.add(i / rate);
  for (const clip of clips) for (const track of clip.tracks) for (const time of track.times) found.add(time);
  return [...found].sort((a, b) => a - b);
}
