// What Chromium makes of a moving picture.

globalThis.watched = async ({ file, type }) => {
  const bytes = await (await fetch(file)).arrayBuffer();
  return type.startsWith("video/") ? await film(new Blob([bytes], { type })) : await picture(bytes, type);
};

async function picture(data, type) {
  const decoder = new ImageDecoder({ data, type });
  await decoder.tracks.ready;
  const track = decoder.tracks.selectedTrack;
  let microseconds = 0;
  for (let index = 0; index < track.frameCount; index += 1) {
    const { image } = await decoder.decode({ frameIndex: index, completeFramesOnly: true });
    microseconds += image.duration ?? 0;
    image.close();
  }
  const loops = Number.isFinite(track.repetitionCount) ? track.repetitionCount : null;
  return { frames: track.frameCount, seconds: microseconds / 1e6, loops };
}

async function film(blob) {
  const video = document.querySelector("video");
  const happens = (name) => new Promise((done, fail) => {
    video.addEventListener(name, done, { once: true });
    video.addEventListener("error", () => fail(new Error(video.error?.message)), { once: true });
  });
  const loaded = happens("loadeddata");
  video.src = URL.createObjectURL(blob);
  await loaded;
  // The last frame can be reached and is decoded.
  const sought = happens("seeked");
  video.currentTime = video.duration;
  await sought;
  return { seconds: video.duration, size: [video.videoWidth, video.videoHeight] };
}

globalThis.isReady = true;
