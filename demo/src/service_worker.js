// Keeps the files of the page, so that it works offline, and those of M1-concat once they were asked for. The build fills
// in VERSION, FILES and LATER.
// Copies of the page at other paths share the origin's caches; the scope tells whose a cache is.
const OWN = `contact ${self.registration.scope}#`;
const CACHE = OWN + VERSION;

self.addEventListener("install", (event) => {
  event.waitUntil(
    caches
      .open(CACHE)
      .then((cache) => cache.addAll(FILES.map((file) => new Request(file, { cache: "no-cache" }))))
      .then(() => self.skipWaiting()),
  );
});

self.addEventListener("activate", (event) => {
  const stale = (name) => name.startsWith(OWN) && name !== CACHE;
  event.waitUntil(
    caches
      .keys()
      .then((names) => Promise.all(names.filter(stale).map((name) => caches.delete(name))))
      .then(() => self.clients.claim()),
  );
});

const answer = async (request) => {
  const cache = await caches.open(CACHE);
  const kept = await cache.match(request, { ignoreSearch: true });
  if (kept) return kept;
  const fetched = await fetch(request);
  const later = LATER.some((file) => new URL(file, self.registration.scope).href === request.url);
  if (later && fetched.ok) await cache.put(request, fetched.clone());
  return fetched;
};

self.addEventListener("fetch", (event) => {
  if (event.request.method === "GET") event.respondWith(answer(event.request));
});
