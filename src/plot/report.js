
const zoom = document.getElementById("zoom"), big = zoom.querySelector("img"), said = zoom.querySelector("p");
for (const link of document.querySelectorAll("figure a")) {
  link.addEventListener("click", (event) => {
    if (!zoom.showModal) return;
    event.preventDefault();
    const small = link.querySelector("img");
    big.onerror = () => { big.onerror = null; big.src = small.src; };
    big.src = link.getAttribute("href");
    said.textContent = small.alt;
    zoom.showModal();
  });
}
zoom.addEventListener("click", () => zoom.close());
